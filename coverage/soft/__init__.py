"""The soft estimator: differentiable coverage over points sampled once."""
