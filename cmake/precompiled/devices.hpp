// Of the drive models, the core and what tests them. Without axis.hpp, whose parts change too often.
#pragma once

#include "cmake/precompiled/buses.hpp"
#include "devices/axis/planner.hpp"
#include "devices/axis/settings.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/descriptor.hpp"
#include "devices/machine.hpp"
