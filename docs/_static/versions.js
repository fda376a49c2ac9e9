// A choice of versions beside the name of this one, where a file versions.json beside the folder of
// these pages lists them, newest first: ["1.0.0", "0.1.0"]. Each is the name of a folder beside it.
// Without the file, as on a disk, the name of this version stays.
(async () => {
  const place = document.querySelector("[data-version]");
  if (!place) return;
  const own = place.dataset.version;
  const root = new URL(document.documentElement.dataset.content_root ?? "./", location.href);
  const beside = new URL("../", root);
  let versions;
  try {
    const answer = await fetch(new URL("versions.json", beside));
    versions = answer.ok ? await answer.json() : [];
  } catch {
    return;
  }
  if (!Array.isArray(versions)) return;
  const names = versions.filter((name) => typeof name === "string" && /^\w[\w.-]*$/.test(name));
  if (!names.includes(own)) return;
  const choice = document.createElement("select");
  choice.setAttribute("aria-label", "Version of these pages");
  for (const name of names) choice.add(new Option(name, name, name === own, name === own));
  choice.addEventListener("change", async () => {
    const site = new URL(`${choice.value}/`, beside);
    const page = new URL(location.href.slice(root.href.length), site);
    const there = await fetch(page, { method: "HEAD" }).catch(() => ({ ok: false }));
    location.assign(there.ok ? page : site); // a page that the other version lacks: its first page
  });
  place.replaceChildren(choice);
})();
