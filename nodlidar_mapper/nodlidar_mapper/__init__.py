"""Maps of buildings from deskewed clouds and odometry."""
