"""Rules of Bullet that differ from MuJoCo's: inertia, motors, materials and contact order."""
