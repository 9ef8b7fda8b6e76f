#pragma once

#include <optional>
#include <string>
#include <vector>

#include "spindle/commands/commands.hpp"
#include "spindle/statistics/assessment.hpp"
#include "spindle/statistics/counts.hpp"
#include "spindle/work/study.hpp"

namespace spindle::commands {

using work::Quantity;
using work::Stratum;

/// What is said of one quantity of one stratum.
struct AssessedQuantity {
  Quantity quantity = Quantity::torque;
  work::StudiedValues values = {};
  statistics::Specification specification = {};
  statistics::Assessment assessment = {};
  std::optional<statistics::Indices> machine = std::nullopt;  ///< only where it was asked for

  [[nodiscard]] statistics::Series series() const;
};

struct AssessedStratum {
  const Stratum* stratum = nullptr;
  work::PerQuantity<AssessedQuantity> quantities = {};
  std::optional<statistics::Yield> yield = std::nullopt;
};

/// All that a report says, whatever it looks like.
struct Assessed {
  const work::Study* study = nullptr;
  std::vector<AssessedStratum> strata = {};
  std::vector<std::string> unmet = {};  ///< a line for each requirement that is not met
};

Assessed assess_study(const work::Study& study, const ReportOptions& options);

/// "ppk=1.33" or "angle.cpk=1.67" or "yield=0.99".
struct Requirement {
  enum class Index : std::uint8_t { pp, ppk, cp, cpk, yield };
  Index index = Index::ppk;
  Quantity quantity = Quantity::torque;
  Decimal least = Decimal(0);
  std::string text = {};  ///< as typed
};
Result<std::vector<Requirement>> read_requirements(const std::vector<std::string>& texts);

/// What the stratum has of it, or of its lower bound; empty: it cannot be judged, as there are too
/// few values, no limits, or for Cp and Cpk no stability.
std::optional<double> fulfilment_of(const Requirement& requirement, RequiredOf of,
                                    const AssessedStratum& stratum);

}  // namespace spindle::commands
