//! Motion as numbers: forward kinematics, rotations, Procrustes, smoothing, bone lengths; readers and writers of motion files. Pure but for those files.

pub mod authors_txt;
pub mod body_view;
pub mod bones;
pub mod bvh_read;
pub mod bvh_write;
pub mod clip_figures;
pub mod finger_bvh;
pub mod finger_files;
pub mod finger_labels;
pub mod finger_npz;
pub mod finger_take;
pub mod fk;
pub mod hand_bones;
pub mod hand_maps;
pub mod hand_view;
pub mod joint_names;
pub mod joints_npz;
pub mod keypoints_npz;
pub mod mocap;
pub mod npy;
pub mod npz;
pub mod procrustes;
pub mod rotation;
pub mod smooth;
pub mod upper_body;
pub mod vec3;
