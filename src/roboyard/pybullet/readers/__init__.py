"""SDF and MJCF files as Bullet reads them."""
