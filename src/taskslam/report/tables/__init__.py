"""Tables in LaTeX, CSV and Markdown."""
