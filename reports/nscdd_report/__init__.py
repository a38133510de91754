"""Page, figures and summary from the JSON and state files of `nscdd run` and `nscdd compare`."""
