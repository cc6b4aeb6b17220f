//! Motion as numbers: forward kinematics, rotations, Procrustes, smoothing, bone lengths; readers and writers of motion files. Pure but for those files.
