"""What a diagnosis leaves on disk: JSON documents, parameter sets, the folder of results."""
