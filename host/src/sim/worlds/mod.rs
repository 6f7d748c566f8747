//! The scenes there are: one file each, and one line here.

mod building;
mod outdoor;
mod traffic;

use super::Scene;

pub(super) const SCENES: [Scene; 3] = [building::SCENE, outdoor::SCENE, traffic::SCENE];
