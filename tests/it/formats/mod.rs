//! Readers and writers of file formats.

mod authors_txt;
mod bvh_write;
mod frames;
mod joints_description;
mod keypoints_npz;
mod motion_file;
mod wav;
