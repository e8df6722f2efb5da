"""Read and write URDF."""
