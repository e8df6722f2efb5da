"""The steps of an import, in the order in which `roboyard.importer.run` takes them, one a file."""
