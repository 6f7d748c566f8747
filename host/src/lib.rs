//! What a computer adds to the core: services over shared memory, a simulated robot, recorded logs.
