#include "tests/support/source_tree.hpp"

namespace axisd::test {

std::string in_source_tree(std::string_view relative) {
  return std::string(AXISD_SOURCE_DIR "/").append(relative);
}

}  // namespace axisd::test
