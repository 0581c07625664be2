// A configuration that somebody sends, and that is only looked at.
#pragma once

#include <set>
#include <string>
#include <string_view>

#include "config/configuration.hpp"

namespace axisd::config {

/// As load_text(), but of the files that it names only those below the folder of `file_name`, and `others`,
/// are read: whoever sends it shall not learn what else this computer has.
LoadResult load_clients_text(std::string_view text, const std::string& file_name,
                             const std::set<std::string>& others, const TlsCheck& check_tls,
                             Duration longest);

/// The files that `configuration` names, as full paths.
[[nodiscard]] std::set<std::string> named_files(const Configuration& configuration);

}  // namespace axisd::config
