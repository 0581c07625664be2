// Of the tests with a whole core in virtual time.
#pragma once

#include "cmake/precompiled/devices.hpp"
#include "cmake/precompiled/tests.hpp"
#include "tests/support/rig.hpp"
