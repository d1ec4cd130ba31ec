//! What only a browser has: the workers, files, and the mirror of the page for assistive technology. Nothing here draws, trains or decides.

#[cfg(feature = "page")]
mod aria;
mod faults;
#[cfg(feature = "page")]
mod files;
#[cfg(feature = "page")]
mod hands;
mod measures;
#[cfg(feature = "page")]
mod mirror;
#[cfg(feature = "page")]
pub mod page;
#[cfg(feature = "page")]
mod place;
#[cfg(feature = "page")]
mod textures;
pub mod worker;
