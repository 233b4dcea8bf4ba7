// SPDX-License-Identifier: MIT
#include "tools/prismrelay/schema_check.hpp"

#include <utility>

#include "tools/prismrelay/schema.hpp"

namespace prism::prismrelay {
namespace {

// Common to both queries. `pairs`: expected relations (temporary) with those found; `columns`: the same for the columns
// of pairs of the same kind. Indexes of primary keys are compared as constraints.
constexpr const char* kSchemaPairs = R"sql(
CREATE TEMPORARY VIEW check_kinds AS SELECT * FROM (VALUES ('r', 'table'), ('p', 'partitioned table'), ('v', 'view'),
  ('i', 'index'), ('I', 'partitioned index'), ('m', 'materialized view'), ('f', 'foreign table'), ('S', 'sequence'),
  ('c', 'type')) AS kinds(kind, name);
CREATE TEMPORARY VIEW check_pairs AS
SELECT e.relname AS name, e.oid AS expected, f.oid AS found, e.relkind AS kind, f.relkind AS found_kind
FROM pg_class e LEFT JOIN pg_class f ON f.relname = e.relname AND f.relnamespace = to_regnamespace('prism')
WHERE e.relnamespace = pg_my_temp_schema() AND e.relname NOT LIKE 'check\_%'
  AND NOT EXISTS (SELECT FROM pg_constraint WHERE conindid = e.oid);
CREATE TEMPORARY VIEW check_columns AS
SELECT p.name, p.kind, e.attnum, e.attname AS column_name, e.attnotnull, format_type(e.atttypid, e.atttypmod) AS type,
       pg_get_expr(d.adbin, d.adrelid) AS default_value, format_type(f.atttypid, f.atttypmod) AS found_type
FROM check_pairs p
JOIN pg_attribute e ON e.attrelid = p.expected AND e.attnum > 0
LEFT JOIN pg_attrdef d ON d.adrelid = e.attrelid AND d.adnum = e.attnum
LEFT JOIN pg_attribute f ON f.attrelid = p.found AND f.attname = e.attname AND NOT f.attisdropped
WHERE p.kind = p.found_kind AND p.kind IN ('r', 'p', 'v');
CREATE TEMPORARY VIEW check_keys AS
SELECT p.name, pg_get_constraintdef(e.oid) AS key, pg_get_constraintdef(f.oid) AS found_key
FROM check_pairs p
JOIN pg_constraint e ON e.conrelid = p.expected AND e.contype = 'p'
LEFT JOIN pg_constraint f ON f.conrelid = p.found AND f.contype = 'p'
WHERE p.kind = p.found_kind;
)sql";

// In the order in which they are created. An empty statement: schema_sql() creates the object.
constexpr const char* kMissingObjects = R"sql(
SELECT what, statement FROM (
  SELECT 1 AS rank, 0 AS attnum, p.name, format('%s %s', k.name, p.name) AS what, '' AS statement
  FROM check_pairs p JOIN check_kinds k ON k.kind = p.kind::text WHERE p.found IS NULL
  UNION ALL
  SELECT 2, attnum, name, format('column %s.%s', name, column_name),
         format('ALTER TABLE prism.%I ADD COLUMN %I %s', name, column_name, type) ||
         coalesce(' DEFAULT ' || default_value, '') || CASE WHEN attnotnull THEN ' NOT NULL' ELSE '' END
  FROM check_columns WHERE found_type IS NULL AND kind <> 'v'
  UNION ALL
  SELECT 3, 0, name, format('primary key of %s', name), format('ALTER TABLE prism.%I ADD %s', name, key)
  FROM check_keys WHERE found_key IS NULL
) AS missing ORDER BY rank, name, attnum
)sql";

constexpr const char* kSchemaDifferences = R"sql(
SELECT what FROM (
  SELECT format('found the %s prism.%s, expected a %s', coalesce(f.name, 'object'), p.name, e.name) AS what
  FROM check_pairs p JOIN check_kinds e ON e.kind = p.kind::text LEFT JOIN check_kinds f ON f.kind = p.found_kind::text
  WHERE p.found_kind <> p.kind
  UNION ALL
  SELECT format('column prism.%s.%s has the type %s, expected %s', name, column_name, found_type, type)
  FROM check_columns WHERE found_type <> type
  UNION ALL
  SELECT format('view prism.%s has no column %s; drop the view to get a new one', name, column_name)
  FROM check_columns WHERE found_type IS NULL AND kind = 'v'
  UNION ALL
  SELECT format('prism.%s has %s, expected %s', name, found_key, key) FROM check_keys WHERE found_key <> key
  UNION ALL
  SELECT format('column prism.%s.%s is NOT NULL without a default, and prismrelay does not write it', p.name, a.attname)
  FROM check_pairs p JOIN pg_attribute a ON a.attrelid = p.found
  WHERE p.kind = p.found_kind AND p.kind IN ('r', 'p') AND a.attnum > 0 AND NOT a.attisdropped AND a.attnotnull
    AND NOT a.atthasdef AND a.attidentity = ''
    AND NOT EXISTS (SELECT FROM pg_attribute e WHERE e.attrelid = p.expected AND e.attname = a.attname)
  UNION ALL
  SELECT format('index prism.%s is of table %s (%s), expected of table %s (%s)', p.name, f.indrelid::regclass,
                pg_get_indexdef(f.indexrelid, 1, true), (SELECT relname FROM pg_class WHERE oid = e.indrelid),
                pg_get_indexdef(e.indexrelid, 1, true))
  FROM check_pairs p JOIN pg_index e ON e.indexrelid = p.expected JOIN pg_index f ON f.indexrelid = p.found
  JOIN check_pairs t ON t.expected = e.indrelid
  WHERE p.kind = p.found_kind AND (t.found IS DISTINCT FROM f.indrelid
    OR pg_get_indexdef(f.indexrelid, 1, true) <> pg_get_indexdef(e.indexrelid, 1, true))
) AS differences ORDER BY what
)sql";

}  // namespace

Result<SchemaCheck> check_schema(Postgres& connection, Postgres::Deadline until) {
  for (const std::string& sql : {reference_sql(), std::string(kSchemaPairs)}) {
    if (const auto done = connection.run(sql, until); !done) return tl::unexpected<Error>(done.error());
  }
  const auto missing = connection.run(kMissingObjects, until);
  if (!missing) return tl::unexpected<Error>(missing.error());
  const auto differences = connection.run(kSchemaDifferences, until);
  if (!differences) return tl::unexpected<Error>(differences.error());
  const auto any = connection.run("SELECT count(found) = 0 FROM check_pairs", until);
  if (!any) return tl::unexpected<Error>(any.error());
  SchemaCheck check;
  check.is_empty = field(*any, 0, 0) == "t";
  for (int i = 0; i < PQntuples(missing->get()); ++i) {
    check.missing.push_back(field(*missing, i, 0));
    if (std::string statement = field(*missing, i, 1); !statement.empty())
      check.statements.push_back(std::move(statement));
  }
  for (int i = 0; i < PQntuples(differences->get()); ++i) check.differences.push_back(field(*differences, i, 0));
  return check;
}

}  // namespace prism::prismrelay
