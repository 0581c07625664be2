// Boost.JSON is compiled here, once for all who include it: its package has headers only.
#include <boost/json/src.hpp>
