"""Tables, figures and report pages; reads tables, never trains."""
