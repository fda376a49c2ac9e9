"""The soft estimator: coverage with a gradient, over points sampled once."""
