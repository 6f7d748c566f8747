//! The scenes there are: one file each, and one line here. Depends on everything else of the simulator.

mod building;
mod outdoor;
mod traffic;

use super::scene::Scene;

const SCENES: [Scene; 3] = [building::SCENE, outdoor::SCENE, traffic::SCENE];

/// There is no scene of that name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no simulated world is called {name:?}; there are: {}", Scene::names().collect::<Vec<_>>().join(", "))]
pub struct UnknownScene {
    /// The name asked for.
    pub name: String,
}

impl Scene {
    /// The scene of that name.
    ///
    /// # Errors
    /// [`UnknownScene`] lists the names there are.
    pub fn named(name: &str) -> Result<&'static Self, UnknownScene> {
        SCENES.iter().find(|scene| scene.name == name).ok_or_else(|| UnknownScene { name: name.to_owned() })
    }

    /// The names of all scenes.
    pub fn names() -> impl Iterator<Item = &'static str> {
        SCENES.iter().map(|scene| scene.name)
    }
}
