//! A moving scene: geometry, materials, light, and the motion of the rig. Enters: bytes of scene files. Leaves: radiance along
//! rays in photons per second, per band; ground-truth poses, depth. It knows no lens and no pixel, and touches no disk.
pub mod motion;
