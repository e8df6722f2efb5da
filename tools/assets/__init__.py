"""Generator of the bundled robots: meshes, textures and URDFs under `src/roboyard/assets`."""
