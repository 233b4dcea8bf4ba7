-- SPDX-License-Identifier: MIT
-- Version 2, of prism 0.4: columns of the log that 0.3 did not have.
ALTER TABLE prism.rows
  ADD COLUMN IF NOT EXISTS sent_deg_per_h double precision, ADD COLUMN IF NOT EXISTS offset_deg_per_h double precision;
UPDATE prism.version SET version = 2;
