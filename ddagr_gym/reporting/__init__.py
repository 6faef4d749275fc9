"""Pictures: scenes and their renderer, video, figures. Drawing libraries are imported where they are used."""
