// Everything.
#pragma once

#include <swarmfit/backend.hpp>
#include <swarmfit/bench.hpp>
#include <swarmfit/cloud.hpp>
#include <swarmfit/error.hpp>
#include <swarmfit/figures.hpp>
#include <swarmfit/fit.hpp>
#include <swarmfit/gallery.hpp>
#include <swarmfit/images.hpp>
#include <swarmfit/model.hpp>
#include <swarmfit/perception.hpp>
#include <swarmfit/points.hpp>
#include <swarmfit/results.hpp>
#include <swarmfit/scene.hpp>
#include <swarmfit/version.hpp>
