# Install rules and the exported package swarmfit::swarmfit.
