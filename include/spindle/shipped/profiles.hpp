#pragma once

#include "spindle/files/shipped_profile.hpp"

namespace spindle::shipped {

/// The profiles of the folder `profiles` as they were when the program was built.
files::ShippedProfiles profiles();

}  // namespace spindle::shipped
