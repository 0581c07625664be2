// What no single key can tell: checks between keys, against the model and against the other axes.
#pragma once

#include "config/configuration.hpp"
#include "config/diagnostics.hpp"
#include "config/reader.hpp"

namespace axisd::config {

/// Server, buses, and how axes and devices share them.
void check_machine(const Configuration& configuration, Diagnostics& diagnostics, const Places& places);

/// The files of `server.tls`, where its keys are right.
void check_tls_files(const Configuration& configuration, const TlsCheck& check, Diagnostics& diagnostics,
                     const Places& places);

/// Each device by itself.
void check_devices(const Configuration& configuration, Diagnostics& diagnostics, const Places& places);

/// Buses with `budget: refuse` against what is asked of them. Precondition: there is no other finding.
void check_budgets(const Configuration& configuration, Diagnostics& diagnostics, const Places& places);

/// Fills in what follows from other keys (travel, settings of the model), then checks the axis by itself.
void complete_axis(AxisEntry& entry, Diagnostics& diagnostics, const Places& places);

}  // namespace axisd::config
