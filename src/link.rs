//! CSI-2 packets, lanes and bandwidth. Enters: codes and features of a frame. Leaves: bytes, and their decoder for the host.
