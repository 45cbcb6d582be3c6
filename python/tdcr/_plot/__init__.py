"""Pictures of shapes, obstacles, workspaces, grasps and fits. Imported on first use."""
