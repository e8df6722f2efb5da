"""PyBullet's GUI as a page in the browser, which connect(GUI) opens."""
