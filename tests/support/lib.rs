//! The rig that the behaviour tests share.
