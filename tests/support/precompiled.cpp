/// Compiles precompiled.hpp.
