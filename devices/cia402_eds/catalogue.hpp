// The parameters of a drive that only an EDS describes.
#pragma once

#include <deque>
#include <string>
#include <vector>

#include "buses/canopen/eds.hpp"
#include "devices/descriptor.hpp"

namespace axisd::cia402_eds {

/// Rows and the texts that they point to. Not copied: the rows point into `texts`.
struct Catalogue {
  Catalogue() = default;
  Catalogue(const Catalogue&) = delete;
  Catalogue& operator=(const Catalogue&) = delete;
  Catalogue(Catalogue&&) noexcept = default;
  Catalogue& operator=(Catalogue&&) noexcept = default;

  std::vector<ParameterSpec> rows;  ///< in order of address
  std::deque<std::string> texts;
};

/// Every object of the EDS that holds a whole number of at most 32 bits. Names are those of the EDS in snake
/// case
/// ("profile_velocity"), with index and sub-index where one alone would not be unique ("cob_id_1400_01").
/// Where the EDS has no limits, those of the type hold; a default with $NODEID is none.
Catalogue catalogue_of(const canopen::Eds& eds);

}  // namespace axisd::cia402_eds
