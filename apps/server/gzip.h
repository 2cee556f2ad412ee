// Answers made smaller for clients that take gzip.
#pragma once

#include "apps/server/message.h"

namespace btms {

// Texts of a kilobyte and more: JSON, scripts, styles. Rasters are left alone: raw tiles of float32 shrink by a third at
// fifty times the cost of sending them, the other forms are compressed already.
//
// A compressed answer is a representation of its own: its validator ends in -gzip. `undo` takes that off what a request
// names, so that handlers see validators as they made them; true when there was one.
bool undo_gzip_validators(Request& request);
void gzip_for(const Request& request, bool had_gzip_validator, Response& response);

}  // namespace btms
