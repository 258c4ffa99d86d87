//! Names, headers and figures of an EuRoC folder.

use crate::optics::lens::Lens;
use crate::pose::Pose;
use crate::scene::motion::imu::ImuNoise;
use crate::units::Size;

/// A camera as its `sensor.yaml` states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EurocCamera {
    /// `T_BS`: where the camera sits on the body.
    pub body_from_camera: Pose,
    /// Frames per second, nominal.
    pub rate_hz: f64,
    /// Of its pictures.
    pub size: Size,
    /// By the names that Kalibr gives to models. (EuRoC counts pixels as OpenCV does: centres are integers, as here.)
    pub lens: Lens,
}

/// An IMU as its `sensor.yaml` states it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EurocImu {
    /// `T_BS`: where the IMU sits on the body.
    pub body_from_imu: Pose,
    /// Rate and noise densities.
    pub noise: ImuNoise,
}

pub(super) const CAMERA_HEADER: &str = "#timestamp [ns],filename";
pub(super) const IMU_HEADER: &str = "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],\
                          a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2]";
pub(super) const GROUND_TRUTH_HEADER: &str = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], \
     q_RS_w [], q_RS_x [], q_RS_y [], q_RS_z [], v_RS_R_x [m s^-1], v_RS_R_y [m s^-1], v_RS_R_z [m s^-1], \
     b_w_RS_S_x [rad s^-1], b_w_RS_S_y [rad s^-1], b_w_RS_S_z [rad s^-1], \
     b_a_RS_S_x [m s^-2], b_a_RS_S_y [m s^-2], b_a_RS_S_z [m s^-2]";
pub(super) const GROUND_TRUTH_FOLDER: &str = "state_groundtruth_estimate0";
