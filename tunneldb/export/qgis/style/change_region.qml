<!DOCTYPE qgis PUBLIC 'http://mrcc.com/qgis.dtd' 'SYSTEM'>
<qgis version="3.22.0" styleCategories="AllStyleCategories" hasScaleBasedVisibilityFlag="0" minScale="0" maxScale="0" readOnly="0">
  <renderer-v2 type="RuleRenderer" forceraster="0" enableorderby="1" symbollevels="0">
    <rules key="{change-region}">
      <rule symbol="7" key="{change-region-7}" filter='"change_mean" &gt;= 0.01' label="inwards, 10 mm and more"/>
      <rule symbol="6" key="{change-region-6}" filter='"change_mean" &gt;= 0.005 AND "change_mean" &lt; 0.01' label="inwards, 5 to 10 mm"/>
      <rule symbol="5" key="{change-region-5}" filter='"change_mean" &gt;= 0.002 AND "change_mean" &lt; 0.005' label="inwards, 2 to 5 mm"/>
      <rule symbol="4" key="{change-region-4}" filter='"change_mean" &gt;= 0 AND "change_mean" &lt; 0.002' label="inwards, less than 2 mm"/>
      <rule symbol="3" key="{change-region-3}" filter='"change_mean" &gt; -0.002 AND "change_mean" &lt;= 0' label="outwards, less than 2 mm"/>
      <rule symbol="2" key="{change-region-2}" filter='"change_mean" &gt; -0.005 AND "change_mean" &lt;= -0.002' label="outwards, 2 to 5 mm"/>
      <rule symbol="1" key="{change-region-1}" filter='"change_mean" &gt; -0.01 AND "change_mean" &lt;= -0.005' label="outwards, 5 to 10 mm"/>
      <rule symbol="0" key="{change-region-0}" filter='"change_mean" &lt;= -0.01' label="outwards, 10 mm and more"/>
    </rules>
    <symbols>
      <symbol name="0" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="33,102,172,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="5,48,97,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="1" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="67,147,195,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="5,48,97,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="2" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="146,197,222,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="5,48,97,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="3" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="209,229,240,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="5,48,97,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="4" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="253,219,199,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="103,0,31,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="5" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="244,165,130,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="103,0,31,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="6" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="214,96,77,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="103,0,31,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
      <symbol name="7" type="fill" alpha="1" clip_to_extent="1" force_rhr="0">
        <layer class="SimpleFill" enabled="1" locked="0" pass="0">
          <Option type="Map">
            <Option type="QString" name="color" value="178,24,43,120"/>
            <Option type="QString" name="style" value="solid"/>
            <Option type="QString" name="outline_color" value="103,0,31,255"/>
            <Option type="QString" name="outline_style" value="solid"/>
            <Option type="QString" name="outline_width" value="0.25"/>
            <Option type="QString" name="outline_width_unit" value="MM"/>
            <Option type="QString" name="joinstyle" value="round"/>
          </Option>
        </layer>
      </symbol>
    </symbols>
    <orderby>
      <orderByClause asc="0" nullsFirst="1">"area"</orderByClause>
    </orderby>
  </renderer-v2>
  <labeling type="simple">
    <settings calloutType="simple">
      <text-style fieldName="if(&quot;change_mean&quot; &gt; 0, '+', '-') || format_number(1000 * abs(&quot;change_mean&quot;), 1) || ' mm'" isExpression="1" fontFamily="Sans Serif" namedStyle="Regular" fontWeight="50" fontSize="8" fontSizeUnit="Point" textColor="30,30,30,255" textOpacity="1" multilineHeight="1" allowHtml="0">
        <text-buffer bufferDraw="0" bufferSize="0.7" bufferSizeUnits="MM" bufferColor="255,255,255,215" bufferOpacity="1" bufferJoinStyle="128" bufferNoFill="1"/>
        <background shapeDraw="1" shapeType="0" shapeSizeType="0" shapeSizeX="0.8" shapeSizeY="0.5" shapeSizeUnit="MM" shapeRadiiX="0.8" shapeRadiiY="0.8" shapeRadiiUnit="MM" shapeFillColor="255,255,255,225" shapeBorderColor="150,150,150,255" shapeBorderWidth="0.1" shapeBorderWidthUnit="MM" shapeOpacity="1" shapeJoinStyle="128"/>
        <shadow shadowDraw="0"/>
      </text-style>
      <text-format multilineAlign="1"/>
      <placement placement="8" dist="1.5" distUnits="MM" polygonPlacementFlags="3" priority="8"/>
      <rendering scaleVisibility="1" scaleMin="0" scaleMax="4000" obstacle="1" obstacleFactor="1" displayAll="0" drawLabels="1" upsidedownLabels="0" fontLimitPixelSize="0" mergeLines="0" limitNumLabels="0" minFeatureSize="0"/>
      <dd_properties>
        <Option type="Map">
          <Option type="QString" name="name" value=""/>
          <Option type="Map" name="properties">
            <Option type="Map" name="Color">
              <Option type="bool" name="active" value="true"/>
              <Option type="QString" name="expression" value="if(&quot;change_mean&quot; &gt; 0, '#67001f', '#053061')"/>
              <Option type="int" name="type" value="3"/>
            </Option>
          </Option>
          <Option type="QString" name="type" value="collection"/>
        </Option>
      </dd_properties>
    </settings>
  </labeling>
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
    <field name="old_survey_id" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="old_survey" configurationFlags="None">
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
    <field name="label" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_from" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="arc_to" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="clock" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="area" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="change_mean" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="lod" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
    <field name="change_extreme" configurationFlags="None">
      <editWidget type="TextEdit">
        <config>
          <Option/>
        </config>
      </editWidget>
    </field>
  </fieldConfiguration>
  <expressionfields>
    <field name="clock_text" expression="with_variable('minutes', round(&quot;clock&quot; * 60) % 720, to_string(if(@minutes &lt; 60, 12, floor(@minutes / 60))) || ':' || lpad(to_string(@minutes % 60), 2, '0'))" type="10" typeName="string" subType="0" length="0" precision="0" comment=""/>
  </expressionfields>
  <aliases>
    <alias index="0" field="id" name="Region key"/>
    <alias index="1" field="survey_id" name="Survey key"/>
    <alias index="2" field="survey" name="Survey"/>
    <alias index="3" field="old_survey_id" name="Key of the older survey"/>
    <alias index="4" field="old_survey" name="Older survey"/>
    <alias index="5" field="km" name="Kilometre"/>
    <alias index="6" field="chainage_from" name="Chainage from (m)"/>
    <alias index="7" field="chainage_to" name="Chainage to (m)"/>
    <alias index="8" field="label" name="Station"/>
    <alias index="9" field="arc_from" name="Arc from (m)"/>
    <alias index="10" field="arc_to" name="Arc to (m)"/>
    <alias index="11" field="clock" name="Clock position (h)"/>
    <alias index="12" field="area" name="Area (m²)"/>
    <alias index="13" field="change_mean" name="Mean change, positive inwards (m)"/>
    <alias index="14" field="lod" name="Level of detection (m)"/>
    <alias index="15" field="change_extreme" name="Greatest change (m)"/>
    <alias index="16" field="clock_text" name="Clock position"/>
  </aliases>
  <previewExpression>"label"</previewExpression>
  <mapTip>&lt;b&gt;[% replace("label", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]&lt;/b&gt;, [% with_variable('minutes', round("clock" * 60) % 720, to_string(if(@minutes &lt; 60, 12, floor(@minutes / 60))) || ':' || lpad(to_string(@minutes % 60), 2, '0')) %] o'clock, [% format_number("area", 2) %] m²&lt;br&gt;[% if("change_mean" &gt; 0, 'inwards', 'outwards') %] by [% format_number(1000 * abs("change_mean"), 1) %] mm since [% replace("old_survey", map('&amp;', '&amp;amp;', '&lt;', '&amp;lt;')) %]; greatest [% format_number(1000 * abs("change_extreme"), 1) %] mm; detected from [% format_number(1000 * "lod", 1) %] mm</mapTip>
  <layerGeometryType>2</layerGeometryType>
</qgis>
