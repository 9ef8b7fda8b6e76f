#pragma once

#include <vector>

#include "spindle/commands/context.hpp"
#include "spindle/work/connect.hpp"
#include "spindle/work/register_survey.hpp"

namespace spindle::commands {

/// What has to be known of a tool before raw registers are read, whatever they mean. Where one of
/// them is a secret of some product, the tool is asked first what it is, and keeps its secret.
Need need_of_raw(const std::vector<RegisterSpan>& spans, const Context& context);

}  // namespace spindle::commands
