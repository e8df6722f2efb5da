"""Steps of an import, one a file; `roboyard.importer.build` runs them in order."""
