"""The bar on top of every page: play, pause, step, reset, speed, time, views, quality, pictures, films."""
