-- Viewers of the hub read its views and nothing else; the servers are asked with the rights of the views' owner.
DO $$
BEGIN
    IF to_regrole('tunnel_viewer') IS NOT NULL THEN
        GRANT USAGE ON SCHEMA tunnel_hub TO tunnel_viewer;
        GRANT SELECT ON ALL TABLES IN SCHEMA tunnel_hub TO tunnel_viewer;
        GRANT EXECUTE ON FUNCTION tunnel_hub_internal.warn_away(text), tunnel_hub_internal.warn_lacking(text, text) TO tunnel_viewer;
    END IF;
END
$$;
