//! The browser face of sensel.
