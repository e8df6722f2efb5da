"""The web page of a viewer: server, camera, keys, pointer and requests."""
