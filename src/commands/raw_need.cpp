#include "raw_need.hpp"

#include <algorithm>

#include "spindle/catalogue/register_sets.hpp"

namespace spindle::commands {
namespace {

bool holds_secret(const RegisterSpan& span, const catalogue::Profile& profile) {
  const auto secrets = catalogue::secret_registers(profile, span.table);
  const auto first = secrets.lower_bound(span.from);
  return first != secrets.end() && *first <= span.to;
}

}  // namespace

Need need_of_raw(const std::vector<RegisterSpan>& spans, const Context& context) {
  const auto profiles = context.profiles.load_all();
  const bool may_be_secret =
      std::any_of(profiles.begin(), profiles.end(), [&](const catalogue::Profile& profile) {
        return std::any_of(spans.begin(), spans.end(),
                           [&](const RegisterSpan& span) { return holds_secret(span, profile); });
      });
  return may_be_secret ? Need::raw_secrets : Need::raw_registers;
}

}  // namespace spindle::commands
