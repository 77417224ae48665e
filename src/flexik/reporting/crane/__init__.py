"""Tables, figures and the report page of the crane."""
