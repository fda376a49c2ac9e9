"""What a check of a simulated rig records first, for its tests."""

from place_rings.formats.schema.proposal_models import ProposalFile
from place_rings.rig.check.models import AboutFile, PortModel
from place_rings.rig.check.plan_files import mount_plan_model, rod_plan_model


def about_file(name, scene, setup, stops, plans, **more):
    """Return the record of a check of ``setup``; ``stops`` may be None."""
    return AboutFile(
        setup=name,
        proposal=ProposalFile.of(setup, scene),
        seed=3,
        injected=True,
        moved=True,
        stale_s=0.08,
        voxel=0.05,
        ports=[
            PortModel(name=f"port {i}", count=group.count, baud=460800)
            for i, group in enumerate(setup.groups)
        ],
        seconds=1.0,
        wave=True,
        stops=mount_plan_model(stops) if stops else None,
        trials=[rod_plan_model(plan) for plan in plans],
        version="0",
        **more,
    )
