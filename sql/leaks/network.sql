-- Segmentation networks that owners trained and that stage detect used.

CREATE OR REPLACE VIEW tunnel_api.segmentation_network AS
SELECT n.id, n.version, n.checksum, octet_length(n.model) AS bytes, n.added_by, n.added_at
  FROM tunnel.segmentation_network n;
COMMENT ON VIEW tunnel_api.segmentation_network IS
    'Segmentation networks that owners trained: the value of the parameter detect.model in tunnel_api.run is the id';
COMMENT ON COLUMN tunnel_api.segmentation_network.bytes IS 'Size of the file';
