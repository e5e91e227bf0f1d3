//! Pictures and functions on the adapter; Mesa's lavapipe will do.

mod embed;
mod multiple_tables;
mod painted;
mod progressive;
mod proxies;
mod render_agreement;
mod render_multiple;
mod render_physics;
mod twins_gpu;
mod variation;
mod viewer;
mod visibility_list;
