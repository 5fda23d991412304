from pathlib import Path
def write_report(outcome, path): Path(path).write_text("<html></html>")
