// Of the drive models, the core and what tests them.
#pragma once

#include "cmake/precompiled/buses.hpp"
#include "devices/axis/axis.hpp"
#include "devices/descriptor.hpp"
#include "devices/machine.hpp"
