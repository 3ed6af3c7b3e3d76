/// Includes all public headers of jfpx that require none of CUDA, Bullet and jfpx_thesis.
#pragma once

#include <jfpx/backend.hpp>
#include <jfpx/build.hpp>
#include <jfpx/character.hpp>
#include <jfpx/collide.hpp>
#include <jfpx/contact_generator.hpp>
#include <jfpx/contact_list.hpp>
#include <jfpx/cost_model.hpp>
#include <jfpx/error.hpp>
#include <jfpx/force.hpp>
#include <jfpx/heightfield.hpp>
#include <jfpx/hull.hpp>
#include <jfpx/joint.hpp>
#include <jfpx/material.hpp>
#include <jfpx/nearest.hpp>
#include <jfpx/neighbors.hpp>
#include <jfpx/periodic.hpp>
#include <jfpx/query.hpp>
#include <jfpx/random.hpp>
#include <jfpx/recorded_world.hpp>
#include <jfpx/recording.hpp>
#include <jfpx/scene.hpp>
#include <jfpx/snapshot.hpp>
#include <jfpx/sphere_collider.hpp>
#include <jfpx/trajectory.hpp>
#include <jfpx/world.hpp>
