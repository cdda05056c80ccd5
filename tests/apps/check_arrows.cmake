# Runs the check CHECK of the arrows between rooms on the tree SOURCE_DIR, with the policies of the
# CMake version that the build asks for.
cmake_minimum_required(VERSION 3.25)
include(${CHECK})
