"""How PyBullet's functions are called: arguments, constants, errors and the command table."""
