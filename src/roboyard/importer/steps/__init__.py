"""The steps of an import, in the order in which `roboyard.importer.build` takes them, one a file."""
