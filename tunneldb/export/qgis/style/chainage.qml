<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="RuleRenderer" forceraster="0" enableorderby="0" symbollevels="0">
    <rules key="{root}">
      <rule symbol="0" key="{r0}" filter='"hundred"' label="Each 100 m"/>
      <rule symbol="1" key="{r1}" filter='NOT "hundred"' label="Stations every 10 m" scalemaxdenom="5000" scalemindenom="1"/>
    </rules>
    <symbols>
      <symbol name="0" type="line" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="line_color" value="60,60,60,255"/>
            <Option type="QString" name="line_style" value="solid"/>
            <Option type="QString" name="line_width" value="0.4"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="capstyle" value="flat"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="line" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleLine" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="line_color" value="110,110,110,200"/>
            <Option type="QString" name="line_style" value="solid"/>
            <Option type="QString" name="line_width" value="0.2"/>
            <Option type="QString" name="line_width_unit" value="MM"/>
            <Option type="QString" name="capstyle" value="flat"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
  </renderer-v2>
  <labeling type="rule-based">
    <rules key="{labels}">
      <rule key="{l0}" filter="&quot;hundred&quot;" scalemaxdenom="10000" scalemindenom="1">
        <settings calloutType="simple">
          <text-style fieldName="regexp_replace(&quot;label&quot;, '\\.\\d+$', '')" isExpression="1" fontFamily="Sans Serif" namedStyle="Regular" fontWeight="50" fontSize="7" fontSizeUnit="Point" textColor="40,40,40,255" textOpacity="1" multilineHeight="1" allowHtml="0">
            <text-buffer bufferDraw="1" bufferSize="0.7" bufferSizeUnits="MM" bufferColor="255,255,255,215" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
            <background shapeDraw="0"/>
            <shadow shadowDraw="0"/>
          </text-style>
          <text-format multilineAlign="1"/>
          <placement placement="1" quadOffset="5" dist="0" yOffset="0" xOffset="0.6" offsetUnits="MM" priority="6" geometryGeneratorEnabled="1" geometryGenerator="end_point($geometry)" geometryGeneratorType="PointGeometry" layerType="LineGeometry"/>
          <rendering obstacle="0" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
        </settings>
      </rule>
      <rule key="{l1}" filter="NOT &quot;hundred&quot;" scalemaxdenom="1000" scalemindenom="1">
        <settings calloutType="simple">
          <text-style fieldName="regexp_replace(&quot;label&quot;, '\\.\\d+$', '')" isExpression="1" fontFamily="Sans Serif" namedStyle="Regular" fontWeight="50" fontSize="7" fontSizeUnit="Point" textColor="40,40,40,255" textOpacity="1" multilineHeight="1" allowHtml="0">
            <text-buffer bufferDraw="1" bufferSize="0.7" bufferSizeUnits="MM" bufferColor="255,255,255,215" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
            <background shapeDraw="0"/>
            <shadow shadowDraw="0"/>
          </text-style>
          <text-format multilineAlign="1"/>
          <placement placement="1" quadOffset="5" dist="0" yOffset="0" xOffset="0.6" offsetUnits="MM" priority="6" geometryGeneratorEnabled="1" geometryGenerator="end_point($geometry)" geometryGeneratorType="PointGeometry" layerType="LineGeometry"/>
          <rendering obstacle="0" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
        </settings>
      </rule>
    </rules>
  </labeling>
  <previewExpression>"label"</previewExpression>
  <layerGeometryType>1</layerGeometryType>
</qgis>
