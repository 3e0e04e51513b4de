<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="singleSymbol" forceraster="0" enableorderby="0" symbollevels="0">
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="255,255,255,0"/>
            <Option type="QString" name="style" value="no"/>
            <Option type="QString" name="outline_color" value="60,60,60,255"/>
            <Option type="QString" name="outline_style" value="dot"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <fieldConfiguration>
    <field name="id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="survey" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="number" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="km" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="chainage_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="label_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="ticks" configurationFlags="None">
      <editWidget type="List">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="lining_area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="seen_share" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="wet_area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="leaks" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="gaps" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <aliases>
    <alias index="0" field="id" name="Sheet key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="number" name="Sheet"/>
    <alias index="4" field="km" name="Kilometre"/>
    <alias index="5" field="chainage_from" name="Chainage from (m)"/>
    <alias index="6" field="chainage_to" name="Chainage to (m)"/>
    <alias index="7" field="label_from" name="From"/>
    <alias index="8" field="label_to" name="To"/>
    <alias index="9" field="ticks" name="Stations every 10 m"/>
    <alias index="10" field="lining_area" name="Lining (m²)"/>
    <alias index="11" field="seen_share" name="Share seen"/>
    <alias index="12" field="wet_area" name="Wet area (m²)"/>
    <alias index="13" field="leaks" name="Leaks"/>
    <alias index="14" field="gaps" name="Where leaks could be missed"/>
  </aliases>
  <attributeactions>
    <defaultAction key="Canvas" value="{7d6c7d0e-6a4c-4f0e-9a51-6f0f3c1f8a11}"/>
    <actionsetting id="{7d6c7d0e-6a4c-4f0e-9a51-6f0f3c1f8a11}" name="Where is this: station, chainage, arc, point in space" shortTitle="Where is this?" type="1" capture="0" icon="" notificationMessage="" isEnabledOnlyWhenEditable="0" action="from qgis.core import QgsProject, QgsProviderRegistry&#10;from qgis.utils import iface&#10;&#10;layer = QgsProject.instance().mapLayer('[% @layer_id %]')&#10;server = QgsProviderRegistry.instance().providerMetadata('postgres').createConnection(layer.source(), {})&#10;rows = server.executeSql(&quot;&quot;&quot;&#10;    SELECT tunnel_api.station_label(s.tunnel_id, c.chainage),&#10;           format('chainage %s m, arc %s m', round(c.chainage::numeric, 3), round(c.arc::numeric, 3))&#10;           || coalesce(format('; in space %s, %s, %s', round(ST_X(p)::numeric, 3), round(ST_Y(p)::numeric, 3),&#10;                              round(ST_Z(p)::numeric, 3)), '; off the lining')&#10;      FROM tunnel_api.survey s&#10;     CROSS JOIN (VALUES ([% @click_x %]::float8, [% @click_y %]::float8)) AS c (chainage, arc)&#10;     CROSS JOIN LATERAL tunnel_api.roll(s.id, c.chainage, c.arc) AS p&#10;     WHERE s.id = [% &quot;survey_id&quot; %]&quot;&quot;&quot;)&#10;iface.messageBar().pushInfo(*rows[0])&#10;">
      <actionScope id="Canvas"/>
    </actionsetting>
  </attributeactions>
  <previewExpression>"label_from"</previewExpression>
  <mapTip>&lt;b&gt;[% coalesce(with_variable('x', x(@layer_cursor_point), with_variable('i', floor((@x - "chainage_from") / 10), array_get("ticks", @i) || ' and ' || format_number(@x - "chainage_from" - 10 * @i, 2) || ' m on')), replace("label_from", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) || ' – ' || replace("label_to", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;'))) %]&lt;/b&gt;[% coalesce('&lt;br&gt;chainage ' || format_number(x(@layer_cursor_point), 2) || ' m, arc ' || format_number(y(@layer_cursor_point), 2) || ' m', '') %]</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
