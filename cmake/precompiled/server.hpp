// Of the services.
#pragma once

#include "cmake/precompiled/contract.hpp"
#include "cmake/precompiled/devices.hpp"
