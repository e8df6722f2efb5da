"""The world on a page: nodes, drawings, texts and scans."""
