//! glTF extras → components.
