-- SPDX-License-Identifier: MIT
-- The ledger of prismrelay: each row of each gyro's log once. docs/fleet.md explains.
BEGIN;
CREATE SCHEMA prism;

CREATE TABLE prism.version (version integer PRIMARY KEY);
INSERT INTO prism.version VALUES (1);

-- A row of a log. The key names its place in the log; the arrival, by the host's clock, is in it as the table is divided by it.
-- Every key and every join begins with the gyro: with Citus, distribute all tables by that column.
CREATE TABLE prism.rows (
  gyro text NOT NULL,             -- SITE/NAME
  axis text NOT NULL,
  log uuid NOT NULL,              -- the id of the log's index: an emptied folder is another log
  segment integer NOT NULL,
  row_number integer NOT NULL,    -- in the segment, from 1
  arrival timestamptz NOT NULL,   -- of the second's last frame, by the host's clock
  time timestamptz NOT NULL,      -- end of the second, by the clock of the data
  samples integer,
  missing bigint,
  rate_deg_per_h double precision,
  temperature_degc double precision,
  uhfo_v double precision,
  status bigint,
  mean_rate_deg_per_h double precision,
  mean_temperature_degc double precision,
  slope_degc_per_s double precision,
  mean_uhfo_v double precision,
  bias_deg_per_h double precision,
  sd_deg_per_h double precision,
  corrected_deg_per_h double precision,
  corrected_mean_deg_per_h double precision,
  quality text,
  sd_mean_deg_per_h double precision,
  partial smallint,
  sensors jsonb,                  -- by the name of their column
  PRIMARY KEY (gyro, axis, log, segment, row_number, arrival)
) PARTITION BY RANGE (arrival);
CREATE INDEX rows_arrival ON prism.rows USING brin (arrival);

-- What stands above a segment's rows: its model's id, the description of the frames, the axis' place and mounting.
CREATE TABLE prism.segments (
  gyro text NOT NULL,
  axis text NOT NULL,
  log uuid NOT NULL,
  segment integer NOT NULL,
  file text NOT NULL,
  model text,                     -- id and name
  metadata jsonb NOT NULL,
  noticed timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (gyro, axis, log, segment)
);

-- How far each log has come: written with the rows, in one transaction.
CREATE TABLE prism.places (
  gyro text NOT NULL,
  axis text NOT NULL,
  cursor text NOT NULL,
  log uuid,
  segment integer,
  row_number integer,
  arrival timestamptz,
  rows bigint NOT NULL,           -- carried, since the gyro is known
  updated timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (gyro, axis)
);

-- What a log had and nobody can have any more: rows deleted before they were fetched, a log that was emptied.
CREATE TABLE prism.gaps (
  gyro text NOT NULL,
  axis text NOT NULL,
  noticed timestamptz NOT NULL DEFAULT now(),
  kind text NOT NULL,             -- deleted, or log_changed
  behind text NOT NULL,           -- the cursor
  missing bigint NOT NULL,
  PRIMARY KEY (gyro, axis, behind, kind)
);

-- Lines of a log that are no rows, as they stand there.
CREATE TABLE prism.refused_rows (
  gyro text NOT NULL,
  axis text NOT NULL,
  log uuid NOT NULL,
  segment integer NOT NULL,
  row_number integer NOT NULL,
  why text NOT NULL,
  line text NOT NULL,
  PRIMARY KEY (gyro, axis, log, segment, row_number)
);

-- What happened, as prismd told it.
CREATE TABLE prism.events (
  gyro text NOT NULL,
  time timestamptz NOT NULL,
  severity text NOT NULL,
  kind text NOT NULL,
  text text NOT NULL,
  PRIMARY KEY (gyro, time, kind, text)
);

-- The last row of every gyro and axis.
CREATE VIEW prism.latest AS
SELECT p.gyro, p.axis, p.rows AS rows_carried, p.updated, r.arrival, r.time, r.rate_deg_per_h, r.bias_deg_per_h, r.sd_deg_per_h,
       r.corrected_deg_per_h, r.corrected_mean_deg_per_h, r.temperature_degc, r.uhfo_v, r.quality, s.model
FROM prism.places p
LEFT JOIN prism.rows r ON r.gyro = p.gyro AND r.axis = p.axis AND r.log = p.log AND r.segment = p.segment
                      AND r.row_number = p.row_number AND r.arrival = p.arrival
LEFT JOIN prism.segments s ON s.gyro = p.gyro AND s.axis = p.axis AND s.log = p.log AND s.segment = p.segment;

-- Means of whole seconds, by hour of arrival.
CREATE VIEW prism.hourly AS
SELECT gyro, axis, date_trunc('hour', arrival) AS hour, count(*) AS seconds, sum(missing) AS missing_frames,
       avg(rate_deg_per_h) AS rate_deg_per_h, avg(corrected_deg_per_h) AS corrected_deg_per_h, avg(bias_deg_per_h) AS bias_deg_per_h,
       avg(temperature_degc) AS temperature_degc, avg(uhfo_v) AS uhfo_v,
       (count(*) FILTER (WHERE quality = 'good'))::double precision / count(*) AS good
FROM prism.rows
WHERE partial IS DISTINCT FROM 1
GROUP BY gyro, axis, date_trunc('hour', arrival);

-- Bias stability of a day: the standard deviation of 100 s means (Tao et al. 2019), raw and corrected. The log's means are those
-- of the 100 s window at the end of each second: one in each 100 s is taken.
CREATE VIEW prism.stability AS
SELECT gyro, axis, date_trunc('day', arrival) AS day, count(*) AS blocks,
       stddev_samp(mean_rate_deg_per_h) FILTER (WHERE corrected_mean_deg_per_h IS NOT NULL) AS raw_deg_per_h,
       stddev_samp(corrected_mean_deg_per_h) AS corrected_deg_per_h
FROM prism.rows
WHERE partial IS DISTINCT FROM 1 AND slope_degc_per_s IS NOT NULL AND extract(epoch FROM time)::bigint % 100 = 0
GROUP BY gyro, axis, date_trunc('day', arrival);

-- The days that are kept, and what each takes.
CREATE VIEW prism.days AS
SELECT to_date(right(c.relname, 8), 'YYYYMMDD') AS day, c.reltuples::bigint AS rows_about, pg_total_relation_size(c.oid) AS bytes
FROM pg_inherits i JOIN pg_class c ON c.oid = i.inhrelid
WHERE i.inhparent = 'prism.rows'::regclass AND c.relname ~ '^rows_[0-9]{8}$';
COMMIT;
