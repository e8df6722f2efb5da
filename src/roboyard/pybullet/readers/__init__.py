"""SDF and MJCF files as Bullet reads them, and archives of arrays, which saveBullet writes."""
