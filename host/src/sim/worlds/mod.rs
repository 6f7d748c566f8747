//! The scenes there are: one file each, and one line here.

mod building;
mod outdoor;

use super::Scene;

pub(super) const SCENES: [Scene; 2] = [building::SCENE, outdoor::SCENE];
