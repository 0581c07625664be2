#pragma once

#include <boost/multiprecision/cpp_int.hpp>

namespace axisd {

/// An exact rational. A double converts without rounding, so sums of commanded distances never drift (M19).
using Exact = boost::multiprecision::cpp_rational;

}  // namespace axisd
